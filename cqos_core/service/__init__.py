"""The gRPC service: thin adapters over the library, and the process around them that answers strangers.

`answers` implements each call, `sessions` the edits of a stream, `open_models` those of single calls; none depends on a network. `worker`
runs them in a separate process, `pool` keeps such processes, `callers` and `fair_scheduler` share them. `calls` decides where a call is
answered, and `open_sessions` has the names of sessions; `native` and `web` are the doors.
"""
