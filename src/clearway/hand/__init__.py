"""The dead man's hand: a second small process that flies the held escape where the first dies.

The first process decides; it hands over the escape of every decision, sampled and encoded, with a
pulse. The second process does nothing while the pulse beats. It imports the standard library only,
so that it is small, starts at once and has little that can fail.
"""
