"""The options of all commands that draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from clearway.view.plot.style import Pictures

Form = Annotated[str, typer.Option("--format", help="png, svg or pdf.", rich_help_panel="Pictures")]
Dpi = Annotated[int, typer.Option(help="Dots per inch.", rich_help_panel="Pictures")]
FORM = "png"
DPI = 110


def pictures_of(form: str, dpi: int) -> Pictures:
    """The choice, checked; raises InputError naming the option."""
    from clearway.view.plot.style import Pictures

    return Pictures.check(form, dpi)
