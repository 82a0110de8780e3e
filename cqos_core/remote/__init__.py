"""The contract `cqos.v1` on both of its ends: a service gives the same reports as the library does in this process.

`client.Client` and `client.AsyncClient` are what callers use. For the service, `answers` implements each call (`plans` those
that change documents), `edit_session` the edits of a stream, `open_models` those of single calls. None of these depends on a network.
"""
