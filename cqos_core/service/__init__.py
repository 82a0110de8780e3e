"""The gRPC service: thin adapters over the library, and what a process that answers strangers needs around them.

`answers` says what each call does, `sessions` what edits do; neither knows of a network. `worker` runs them in a process
of its own, `pool` keeps such processes, `callers` and `turns` see to it that everybody gets a share of them, `calls` decides
where a call is answered, `native` and `web` are the doors.
"""
