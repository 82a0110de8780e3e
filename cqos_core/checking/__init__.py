"""Rules over a whole system become findings with fixes: the check itself, its explanation and the session.

`checker.check_system` checks, `explanation.explain_pair` explains, `session.Session` checks again after edits.
"""
