"""Changes of least weight that reach a goal, by a constraint solver.

Each stage is a module. `model` collects the rules and the changeable places of some topics. `formulas` translates conditions. `constraint_solver`
finds the changes of least weight, and `search` applies them and checks the result. A rule is never written a second time: a part of a
condition becomes a table of what the checker itself answers for each combination of values.
"""
