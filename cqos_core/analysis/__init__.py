"""What is built on checks: one pair judged or explained, differences, known findings, logs of programs, plans of runs.

`pair_judge` judges pairs of plain dictionaries, `explanation.explain_pair` explains one pair of a system. `run_plan` makes
of a pair what a run of it needs, and `plan` is what a search for changes returns; both are what distributions beside the core work with.
"""
