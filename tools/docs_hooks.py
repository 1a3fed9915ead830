"""Hooks of mkdocs (see mkdocs.yml): adds the pages of docs/results and docs/design to the navigation."""
from pathlib import Path


def pages_of(source, folder):
    """Paths of a folder's pages: architecture first, the rest sorted by name."""
    found = (source / "docs" / folder).glob("*.md")
    return [str(path.relative_to(source))
            for path in sorted(found, key=lambda path: (path.stem != "architecture", path.name))]


def on_config(config):
    source = Path(config["docs_dir"])
    for section in config["nav"]:
        if "Measurements" in section:
            section["Measurements"] = pages_of(source, "results")
        if "Development" in section:
            section["Development"] = section["Development"] + [{"Design": pages_of(source, "design")}]
    config["nav"] = [section for section in config["nav"] if all(section.values())]
    return config


def on_nav(nav, config, files):
    """Adds a link to the API reference, which Doxygen writes."""
    from mkdocs.structure.nav import Link

    if (Path(config["config_file_path"]).parent / "build/docs/api/html/index.html").exists():
        nav.items.append(Link("API", "api/files.html"))
    return nav
