"""Python sources written as C++ that does the same operations in the same order.

What is understood is what numeric code of small size needs: numbers, tuples, named tuples, settings, traces
of names and numbers; assignments, conditions, loops over a range, returns. Anything else ends the translation
with its place. What the C++ stands on is hil/control/native/outer/python.hpp.
"""
