"""
From a task to a certified plan, its samples, and weights that meet objectives.

Read `plan_path` first, the library's main entry; `plan_problem` tries the strategies and has the
result certified.

"""
