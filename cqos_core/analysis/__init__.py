"""Functions built on checks: judging and explaining one pair, differences, baselines, logs of programs, repairs.

`pair_judge` judges pairs of plain dictionaries, `explanation.explain_pair` explains one pair of a system. `proving` runs pairs on
middleware. `planning` finds changes that reach a goal.
"""
