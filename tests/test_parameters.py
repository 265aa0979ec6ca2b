"""What the import of a class in a package lists."""

from vibrojax.parameters import final_classes


class AbstractKind:
    pass


class Later(AbstractKind):
    pass


class Earlier(AbstractKind):
    pass


def test_final_classes_are_listed_in_the_order_of_import():
    names = {"AbstractKind": AbstractKind, "Later": Later, "text": "text", "other": int, "one": Later(), "Earlier": Earlier}
    assert final_classes(names, AbstractKind) == (Later, Earlier)
