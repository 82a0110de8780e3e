"""Parts of programs that no walk followed."""
