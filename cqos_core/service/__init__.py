"""The gRPC service: processes, servers, limits and sessions around the messages of `cqos_core.remote`.

`worker` answers calls in a separate process. `worker_pool` and `session_host` keep such processes; `caller_quotas` and
`fair_scheduler` share them among callers. `call_dispatch` decides where a call is answered, `call_handlers` answers it, and
`open_sessions` has the names of sessions. `grpc_server` and `web_server` are the servers.
"""
