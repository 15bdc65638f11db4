"""Live view in a browser: worlds side by side, and controls that act at once.

`session` holds the worlds, `server` the page. The page needs viser, which the extra `view`
installs.
"""
