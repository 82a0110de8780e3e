"""Files become systems, and systems become files.

`opening` and `loading` say which files there are and which importer reads each; `merging` makes one system of several. `exporting`
and the modules ``*_writer`` write a system in another form. `applying` and `edits` write fixes into files that exist.
"""
