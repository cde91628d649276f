"""Several people before sensors with unknown extrinsics."""
