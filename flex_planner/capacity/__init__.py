"""
Limits: the largest payload between two postures, and the shortest duration.

`max_payload` and `min_duration` are the entries, `limit_search` is what both share; `bracket` says
when a search ends, `results` what it returns.

"""
