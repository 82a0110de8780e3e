"""Messages and stubs of version 1; the .proto files beside them say what each field means."""
