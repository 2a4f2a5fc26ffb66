"""The targets: each a module that registers itself; `hil.rigs.opening` chooses among them."""
