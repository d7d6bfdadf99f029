"""
What the documentation site makes of the sources: reference pages, formulas, links to files.

`conf.py` has Sphinx call it. It needs neither ROS nor Sphinx, except for `mathml`.

"""
