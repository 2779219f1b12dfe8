"""All three packages write files in one way, `dms_core.files.output_file`: what does not is found in their sources."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = {
    "dms_core/files/output_place.py": {
        "os.fdopen",
        "open",
        "os.replace",
        "os.write",
        "os.unlink",
        "chmod",
        "mkdir",
        "unlink",
    },
    "dms_core/files/outputs.py": {"tempfile.mkdtemp", "unlink", "rmdir"},
    # Nowhere, for streams that are closed.
    "dms_core/command_line.py": {"open"},
    # Gives the text.
    "dms_core/files/yaml_text.py": {"yaml.dump"},
    # Folders that appear whole: their files are written in the one way, then the folder takes its name.
    "agents/checkpoint.py": {"mkdir", "rename", "shutil.rmtree"},
    # Its own file, whose tries stand in another one by then.
    "agents/evaluation/search/tries.py": {"unlink"},
    # Its own file, to which lines are added; one that is not whole is dropped.
    "agents/evaluation/sharing/kept_shares.py": {"open", "unlink"},
    # The lock of a folder, which must stay the same file.
    "agents/training/files/run_folder.py": {"open"},
    # Into a file in memory, from an archive, and into a folder of its own for another program.
    "agents/training/files/model_state.py": {"np.savez", "zipfile.ZipFile"},
    "dms_core/figures.py": {"savefig"},
    "agents/commands/pictures/video.py": {"imageio.get_writer", "tempfile.TemporaryDirectory"},
}
"""What each file may do itself, and why."""
WRITING = {
    "write_text", "write_bytes", "savefig", "np.save", "np.savez", "np.savez_compressed", "np.savetxt", "tofile",
    "to_csv", "torch.save", "imageio.get_writer", "imageio.imwrite", "imageio.mimsave", "json.dump", "yaml.dump",
    "pickle.dump", "os.replace", "os.rename", "os.write", "os.fdopen", "os.unlink", "os.remove", "rename", "unlink",
    "rmdir", "mkdir", "os.mkdir", "os.makedirs", "touch", "symlink_to", "hardlink_to", "chmod", "save_file", "savemat",
    "onnx.save", "onnx.save_model", "shutil.copyfile", "shutil.copy", "shutil.copy2", "shutil.move", "shutil.rmtree",
    "shutil.copytree", "tempfile.mkstemp", "tempfile.mkdtemp", "tempfile.NamedTemporaryFile", "tempfile.TemporaryFile",
    "tempfile.TemporaryDirectory", "zipfile.ZipFile",
}  # fmt: skip
METHODS = {name for name in WRITING if "." not in name}
OURS = {"write_text", "write_bytes"}
"""Names of functions of output_file.py that methods of Path have too."""


def calls(source: str):
    """Calls in a source that write, by name."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        name = ast.unparse(node.func)
        last = name.rpartition(".")[2]
        if last == "open" and name != "os.open" and _mode(node, 0 if "." in name and name != "io.open" else 1):
            yield "open"
        elif name in WRITING and name not in OURS:
            yield name
        elif "." in name and last in METHODS:
            yield last


def _mode(call: ast.Call, place: int) -> bool:
    """Whether a call of open may write."""
    given = [k.value for k in call.keywords if k.arg == "mode"] or call.args[place : place + 1]
    return bool(given) and not (isinstance(given[0], ast.Constant) and set(str(given[0].value)) <= set("rbt"))


@pytest.mark.parametrize("package", ["dms_core", "exo_env", "agents"])
def test_nothing_writes_in_another_way(package):
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        others = set(calls(path.read_text(encoding="utf-8"))) - ALLOWED.get(name, set())
        if others:
            found[name] = others
    assert found == {}, "write with dms_core.files.output_file, or say in ALLOWED why not"


@pytest.mark.parametrize(
    "text",
    ["open(path, 'w')", "path.open(mode='xb')", "open(path, how)", "path.write_text('x')", "np.savez(path, x=1)",
     "figure.savefig(path)", "json.dump(x, file)", "os.replace(a, b)", "torch.save(x, path)",
     "zipfile.ZipFile(p, 'w')"],
)  # fmt: skip
def test_it_would_be_found(text):
    assert list(calls(text))


@pytest.mark.parametrize("text", ["open(path)", "path.open('rb')", "write_text(path, 'x')", "os.open(path, flags)"])
def test_reading_is_not(text):
    assert not list(calls(text))
