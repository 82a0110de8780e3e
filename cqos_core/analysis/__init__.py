"""Functions built on checks: judging and explaining one pair, differences, baselines, logs of programs, plans of runs.

`pair_judge` judges pairs of plain dictionaries, `explanation.explain_pair` explains one pair of a system. `run_plan` makes
the plan for a run of a pair, and `plan` has the results of a search for changes; other distributions work with both.
"""
