"""Files become systems, and systems become files.

`file_search` finds files, `importer_choice` chooses the importer of each, `source_reader` and `path_loader` read them, and
`system_merge` makes one system of several. `export` and the modules ``*_writer`` write a system in another form. `text_edits`,
`edited_files` and `file_fixes` write fixes into existing files.
"""
