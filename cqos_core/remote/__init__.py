"""The client: a service gives the same reports as the library does in this process.

`client.Client` and `client.AsyncClient` are what callers use.
"""
