"""Outputs of a command for tests, and what is left in folders."""

from dms_core.files.output_place import PREFIX
from dms_core.files.outputs import OutputFile, Outputs


def parts(folder):
    """Files that are not whole."""
    return [path for path in folder.rglob("*") if path.name.startswith(PREFIX)]


def outputs(*files, **options):
    """Outputs of a command `test`, files by their options."""
    return Outputs("test", files=[OutputFile(f"--{k}", path) for k, path in enumerate(files)], **options)
