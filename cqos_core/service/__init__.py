"""The gRPC service: the processes, doors, limits and memory of sessions around the answers of `cqos_core.remote`.

`worker` answers calls in a separate process, `pool` keeps such processes, `callers` and `fair_scheduler` share them. `calls` decides where a
call is answered, and `open_sessions` has the names of sessions; `native` and `web` are the doors.
"""
