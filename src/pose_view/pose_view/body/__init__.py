"""A drawn body: parts of the right size at the right place, joints in the right colour."""
