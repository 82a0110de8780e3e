"""Puts a distribution where Python finds it, as an installer would: without building a wheel, which takes seconds."""

import shutil
from pathlib import Path


def install(site, module, *, name=None, version="1.0", author="Somebody Else", entry=None):
    """Install a file or folder as a plugin.

    Args:
        site: the folder to put it into, which has to be on the path.
        module: the module or package, a path; or the name and text of a module, a pair.
        name: of the distribution; that of the module with dashes if it is None.
        version: of the distribution; None leaves the metadata out.
        author: of the distribution.
        entry: name of the entry point; that of the module if it is None.
    """
    if isinstance(module, tuple):
        import_name, text = module
        (site / f"{import_name}.py").write_text(text, encoding="utf-8")
    else:
        path = Path(module)
        import_name = path.stem
        if path.is_dir():
            shutil.copytree(path, site / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(path, site)
    name = name or import_name.replace("_", "-")
    folder = site / f"{name.replace('-', '_')}-{version}.dist-info"
    folder.mkdir()
    if version is not None:
        text = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\nAuthor: {author}\n"
        (folder / "METADATA").write_text(text, encoding="utf-8")
    (folder / "entry_points.txt").write_text(f"[cqos]\n{entry or import_name} = {import_name}\n", encoding="utf-8")
