#!/usr/bin/env python3
"""Checks the documentation: lengths of sentences, sizes of pages, links and anchors.

    tools/check_docs.py                 check everything; exit code 1 after any finding
    tools/check_docs.py --sizes         also print the number of words of each page
    tools/check_docs.py --site DIR      check links and anchors of the built site
    tools/check_docs.py --linked-files  print the files outside docs/ that a page links to;
                                        tools/docs.sh puts them on the site

Words of a page: the prose, and half of the words in tables. Code blocks do not count.
"""
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parent.parent
LONGEST_SENTENCE = 30
# Pages and their largest number of words.
SIZES = [("README.md", 900), ("docs/design/architecture.md", 1200), ("docs/user/*.md", 900)]
# Pages whose sentences are checked.
PLAIN = ["README.md", "docs/index.md", "docs/user/*.md"]

LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]*(?:\([^()]*\)[^()\s]*)*)(?:\s+\"[^\"]*\")?\)")
HTML_LINK = re.compile(r"(?:src|href)=\"([^\"]+)\"")
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|et al|cf|vs|Fig|No|approx)\.", re.IGNORECASE)


def pages(patterns):
    return sorted({path for pattern in patterns for path in ROOT.glob(pattern)})


def tracked_markdown():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"], cwd=ROOT,
                            check=True,
                            capture_output=True, text=True)
    return [path for line in listed.stdout.splitlines() if (path := ROOT / line).exists()]


def lines_without_code(text):
    """Numbered lines outside of fenced code blocks."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark:
            if fence is None:
                fence = mark[1]
            elif mark[1].startswith(fence):
                fence = None
            continue
        if fence is None:
            yield number, line


def plain(text):
    """Text as a reader sees it: links are replaced by their text, code by one word."""
    text = re.sub(r"<!--.*?-->", " ", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", " ", text)
    text = LINK.sub(lambda match: re.match(r"!?\[(.*)\]\(", match[0], re.DOTALL)[1], text)
    text = re.sub(r"`[^`]*`", "code", text)
    text = re.sub(r"<[^>]+>", " ", text)
    return text.replace("**", "").replace("*", "")


def blocks(text):
    """Paragraphs, list items and table cells: (first line, kind, text)."""
    block, begin = [], 0

    def flush():
        nonlocal block
        if block:
            yield begin, "prose", " ".join(block)
        block = []

    for number, line in lines_without_code(text):
        stripped = line.strip()
        if stripped.startswith("|"):
            yield from flush()
            if not re.fullmatch(r"[|\s:-]+", stripped):
                for cell in re.split(r"(?<!\\)\|", stripped.strip("|")):
                    yield number, "table", cell.strip()
            continue
        if not stripped or stripped.startswith("#"):
            yield from flush()
            if stripped:
                yield number, "prose", stripped.lstrip("#").strip()
            continue
        item = re.match(r"(?:[-*+]|\d+\.)\s+(.*)", stripped)
        if item:
            yield from flush()
            stripped = item[1]
        if not block:
            begin = number
        block.append(re.sub(r"^>\s?", "", stripped))
    yield from flush()


def words(text):
    return [word for word in plain(text).split() if re.search(r"\w", word)]


def sentences(text):
    text = ABBREVIATION.sub(lambda match: match[0].replace(".", ""), plain(text))
    return re.split(r"(?<=[.!?])[\"')\]]*\s+", text)


def anchors(path):
    found, seen = set(), {}
    for _, line in lines_without_code(path.read_text(encoding="utf-8")):
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
        if heading:
            text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1]).replace("`", "")
            name = re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")
            found.add(name if name not in seen else f"{name}-{seen[name]}")
            seen[name] = seen.get(name, 0) + 1
        found.update(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", line))
    return found


def links(path):
    for number, line in lines_without_code(path.read_text(encoding="utf-8")):
        line = re.sub(r"`[^`]*`", "", line)
        for match in list(LINK.finditer(line)) + list(HTML_LINK.finditer(line)):
            yield number, match[1]


def target_of(path, link):
    """File and anchor of a link within the repository; None for external links."""
    if re.match(r"[a-z][a-z0-9+.-]*:|//", link):
        return None
    file, _, anchor = unquote(link).partition("#")
    return ((path.parent / file).resolve() if file else path), anchor


def check_links():
    for path in tracked_markdown():
        for number, link in links(path):
            target = target_of(path, link)
            if not target:
                continue
            file, anchor = target
            if not file.exists():
                yield f"{path.relative_to(ROOT)}:{number}: {link}: no such file"
            elif not file.is_relative_to(ROOT):
                yield f"{path.relative_to(ROOT)}:{number}: {link}: outside of the repository"
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                yield f"{path.relative_to(ROOT)}:{number}: {link}: no such heading"


def check_sentences():
    for path in pages(PLAIN):
        for number, _, text in blocks(path.read_text(encoding="utf-8")):
            for sentence in sentences(text):
                count = len(words(sentence))
                if count > LONGEST_SENTENCE:
                    yield f"{path.relative_to(ROOT)}:{number}: {count} words: {' '.join(words(sentence)[:8])} ..."


def size_of(path):
    count = {"prose": 0, "table": 0}
    for _, kind, text in blocks(path.read_text(encoding="utf-8")):
        count[kind] += len(words(text))
    return count["prose"] + count["table"] // 2


def check_sizes(show):
    for pattern, largest in SIZES:
        for path in pages([pattern]):
            size = size_of(path)
            if show:
                print(f"{size:5} of {largest:5} words  {path.relative_to(ROOT)}")
            if size > largest:
                yield f"{path.relative_to(ROOT)}: {size} words; at most {largest}"


def linked_files():
    """Files outside docs/ that pages of the site link to."""
    found = set()
    for path in pages(["*.md", "docs/**/*.md", "config/worlds/README.md", "third_party/README.md"]):
        for _, link in links(path):
            target = target_of(path, link)
            if target and target[0].is_file() and target[0].is_relative_to(ROOT):
                found.add(target[0].relative_to(ROOT))
    return sorted(file for file in found if file.parts[0] != "docs")


def check_site(site):
    """Links and anchors of the built pages; the API reference is Doxygen's own."""
    pages_of_site = [path for path in site.rglob("*.html")
                     if path.relative_to(site).parts[0] != "api" and path.name != "404.html"]
    ids = {}
    for page in pages_of_site:
        text = page.read_text(encoding="utf-8")
        for link in re.findall(r"<(?:a|img)\b[^>]*?(?:href|src)=\"?([^\"\s>]+)", text):
            target = target_of(page, link)
            if not target:
                continue
            file, anchor = target
            if not file.exists():
                yield f"{page.relative_to(site)}: {link}: no such file"
            elif anchor and file.suffix == ".html" and not file.is_relative_to(site / "api"):
                if file not in ids:
                    ids[file] = set(re.findall(r"\b(?:id|name)=\"?([^\"\s>]+)", file.read_text(encoding="utf-8")))
                if anchor not in ids[file]:
                    yield f"{page.relative_to(site)}: {link}: no such heading"


def main():
    if "--site" in sys.argv:
        findings = [*check_site(Path(sys.argv[sys.argv.index("--site") + 1]).resolve())]
        for finding in findings:
            print(finding, file=sys.stderr)
        return 1 if findings else 0
    if "--linked-files" in sys.argv:
        print("\n".join(map(str, linked_files())))
        return 0
    findings = [*check_sentences(), *check_sizes("--sizes" in sys.argv), *check_links()]
    for finding in findings:
        print(finding, file=sys.stderr)
    print(f"docs: {len(findings)} findings in {len(tracked_markdown())} pages")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
