"""The spring law: contact forces from penetrations."""
