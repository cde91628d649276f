"""Several people before sensors whose places are not known yet."""
