"""Docstrings of this project as Griffe reads them: sections that it knows under another name."""

import griffe


class HouseSections(griffe.Extension):
    """`Example:` becomes `Examples:`, and the `Arguments:` of a class, which are its fields, become `Attributes:`."""

    def on_instance(self, *, obj, **kwargs):
        """Rename them before the docstring is parsed."""
        if obj.is_alias or obj.docstring is None:
            return
        text = obj.docstring.value.replace("\nExample:\n", "\nExamples:\n")
        if obj.is_class:
            text = text.replace("\nArguments:\n", "\nAttributes:\n")
        obj.docstring.value = text
