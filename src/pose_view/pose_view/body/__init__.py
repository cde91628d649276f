"""A drawn body: meshes of its parts and marks of its joints."""
