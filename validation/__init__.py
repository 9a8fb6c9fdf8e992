"""Our numbers beside those of others: ``python -m validation`` writes docs/validation.md.

Others' numbers lie in ``theirs/``, typed in or pasted by hand; nothing here, and no test, writes there. How those of
programs were found is in ``others/``, whose modules only print.
"""
