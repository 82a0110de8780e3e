"""Paths and bytes become systems: which files there are, which importer reads each, and several systems as one.

`loading.load_paths` and `loading.read_together` are what others call.
"""
