"""The workflows of a public forge, which cannot run here: each step is a make target, on what is supported."""

import re
import shlex
import subprocess
from itertools import product
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
GITHUB = ROOT / ".github"
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in GITHUB.glob("workflows/*.yml")}
JOBS = {(page, name): job for page, workflow in WORKFLOWS.items() for name, job in workflow["jobs"].items()}
SYSTEMS = {"ubuntu-latest", "windows-latest", "macos-latest"}
README = (ROOT / "README.md").read_text(encoding="utf-8")
SYSTEMS_PAGE = (ROOT / "docs" / "systems.md").read_text(encoding="utf-8")
TESTED = set(re.findall(r"bpy module (\d+\.\d+\.\d+)", SYSTEMS_PAGE))
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.search(r"^\.PHONY: (.*)", MAKEFILE, re.MULTILINE)[1].split())


def cells(job):
    """The job's runs: the names of `matrix` with what each stands for."""
    axes = dict(job.get("strategy", {}).get("matrix", {}))
    rows = axes.pop("include", [{}])
    for row, *values in product(rows, *axes.values()):
        cell = row | dict(zip(axes, values, strict=True))
        yield {
            f"matrix.{name}{'.' + inner if inner else ''}": str(text)
            for name, value in cell.items()
            for inner, text in (value.items() if isinstance(value, dict) else [("", value)])
        }


def filled(text, cell):
    return re.sub(r"\$\{\{ *([\w.]+) *\}\}", lambda match: cell[match[1]], text)


def commands(key):
    """All command lines of a job, with what its matrix stands for."""
    return [filled(step["run"], cell) for cell in cells(JOBS[key]) for step in JOBS[key]["steps"] if "run" in step]


def makes(line):
    """Variables of a call of make, which is of one target."""
    program, target, *variables = shlex.split(line)
    assert program == "make", line
    assert target in TARGETS, line
    return target, dict(variable.split("=", 1) for variable in variables)


@pytest.mark.parametrize("key", JOBS, ids="-".join)
def test_each_step_is_a_make_target_that_make_knows(key):
    lines = commands(key)
    assert lines
    for line in lines:
        _, variables = makes(line)
        assert set(variables) <= {"PYTHON", "BPY", "TESTS"}, line
        assert all((ROOT / folder).is_dir() for folder in variables.get("TESTS", "").split())
        subprocess.run([*shlex.split(line), "--dry-run"], cwd=ROOT, check=True, capture_output=True)


@pytest.mark.parametrize("key", JOBS, ids="-".join)
def test_each_job_checks_out_and_has_the_python_of_its_blender(key):
    for cell in cells(JOBS[key]):
        assert filled(JOBS[key]["runs-on"], cell) in SYSTEMS
        uses = {step["uses"].split("@")[0]: step for step in JOBS[key]["steps"] if "uses" in step}
        assert list(uses)[:2] == ["actions/checkout", "actions/setup-python"]
        python = filled(uses["actions/setup-python"]["with"]["python-version"], cell)
        for line in (filled(step["run"], cell) for step in JOBS[key]["steps"] if "run" in step):
            blender = makes(line)[1].get("BPY", "4.5.15")
            assert python == ("3.13" if blender.startswith("5.") else "3.11")


def test_lint_types_and_core_need_no_blender_and_core_runs_on_every_system():
    lines = [line for page, job in JOBS if page == "checks" for line in commands((page, job))]
    assert {makes(line)[0] for line in lines} == {"lint", "types", "core"}
    for line in lines:
        done = subprocess.run([*shlex.split(line), "-Bn"], cwd=ROOT, check=True, capture_output=True, text=True)
        assert "bpy==" not in done.stdout
    assert {cell["matrix.os"] for cell in cells(JOBS["checks", "core"])} == SYSTEMS


def test_tests_and_the_installed_zip_run_in_every_blender_of_the_docs():
    for job in ("tests", "installed"):
        assert {makes(line)[1]["BPY"] for line in commands(("blender", job))} == TESTED
    systems = {(cell["matrix.os"], cell["matrix.blender.bpy"]) for cell in cells(JOBS["blender", "installed"])}
    assert systems == set(product(SYSTEMS, TESTED))


def test_hooks_before_commits_are_make_targets():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    assert {makes(hook["entry"])[0] for repository in hooks for hook in repository["hooks"]} == {"lint", "types"}


@pytest.mark.parametrize("path", sorted(GITHUB.glob("ISSUE_TEMPLATE/[!c]*.yml")), ids=lambda path: path.stem)
def test_templates_of_issues_ask_for_something(path):
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert form["name"]
    assert form["description"]
    asked = [field for field in form["body"] if field["type"] != "markdown"]
    assert len({field["id"] for field in asked}) == len(asked)
    assert any(field.get("validations", {}).get("required") for field in asked)


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/development.md"])
def test_pages_for_contributors_name_targets_that_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"^(?:.*`)?make ((?:[a-z_]+\b ?)+)", text, re.MULTILINE)
    assert {target for targets in named for target in targets.split()} <= TARGETS


def test_the_readme_leads_to_the_page_for_contributors():
    assert "](CONTRIBUTING.md)" in README
