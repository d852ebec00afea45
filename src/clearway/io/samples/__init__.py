"""Small inputs of our own making in every format that clearway reads: one writer a format.

Writers stand beside the readers and use nothing of them, so that each is a second opinion on its
format. `registry` lists them.
"""
