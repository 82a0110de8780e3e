"""What is built on checks: differences, known findings, logs of programs, fixes applied to files, runs on middleware."""
