"""Rules over a whole system become findings with fixes: the check itself, and sessions.

`checker.check_system` checks, `session.Session` checks again after edits.
"""
