"""From a trained model to a folder of numbers that anybody can read."""

from dms_core.renamed import replaced

_NOW = f"{__name__.partition('.')[0]}.commands.export"
__getattr__ = replaced(
    __name__, {"export": f"It is now {_NOW}.export.", "from_zip": f"It is now {__name__}.model_zip.from_zip."}
)
