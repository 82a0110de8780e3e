"""What shells complete: asked as their scripts ask, and by a real bash, zsh and fish."""

import os
import re
import shutil
import subprocess

import pytest

from tests.browser import missing
from tests.cli.conftest import COMMAND, environment


@pytest.fixture
def complete(forked):
    """Return what may come next, as C-QoS answers a shell; the last word may be a beginning."""

    def run(*words):
        done = forked(_CQOS_COMPLETE="bash_complete", COMP_WORDS=" ".join(("cqos", *words)), COMP_CWORD=str(len(words)))
        return done.out.split()

    return run


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["ch"], ["plain,check"]),
        (["check", "--require-p"], ["plain,--require-pairs"]),
        (["check", "--select", "ROS10"], [f"plain,ROS10{n}" for n in range(1, 6)]),
        (["check", "--ignore", "CQ405,ros101"], ["plain,CQ405,ROS101"]),
        (["check", "--protocol", "mq"], ["plain,mqtt"]),
        (["check", "--format", "sar"], ["plain,sarif"]),
        (["check", "--option", "ros2.rmw=cy"], ["plain,ros2.rmw=cyclonedds"]),
        (["check", "design"], ["file,design"]),
        (["check", "a.yaml", "--baseline", "kn"], ["file,kn"]),
        (["rule", "CQ60"], [f"plain,CQ60{n}" for n in range(1, 8)]),
        (["packs", "d"], ["plain,dds"]),
        (["convert", "a.yaml", "--to", "qos"], ["plain,qos_overrides"]),
        (["completion", "f"], ["plain,fish"]),
        (["launch", "la"], ["file,la"]),
        (["learn", "sr"], ["file,sr"]),
        (["diff", "a.yaml", "--against", "b"], ["file,b"]),
    ],
)
def test_the_next_word(complete, words, expected):
    assert complete(*words) == expected


BASH = """
source <({command} completion bash)
ask() {{ COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _cqos_completion cqos 2> /dev/null; echo "${{COMPREPLY[*]}}"; }}
ask cqos ch
ask cqos check --select ROS101
ask cqos packs ro
ask cqos check --selec
"""
ZSH = """
autoload -Uz compinit; compinit -D; source <({command} completion zsh)
_describe() {{ print -l -- "${{completions_with_descriptions[@]}}" }}
compadd() {{ print -l -- "${{completions[@]}}" }}
ask() {{ words=("$@"); CURRENT=$#; _cqos_completion }}
ask cqos ch
ask cqos check --select ROS101
ask cqos packs ro
ask cqos check --selec
"""
FISH = "{command} completion fish | source; complete -C 'cqos ch'; complete -C 'cqos check --select ROS101'"
FISH += "; complete -C 'cqos packs ro'; complete -C 'cqos check --selec'"


@pytest.mark.parametrize(("shell", "script"), [("bash", BASH), ("zsh", ZSH), ("fish", FISH)])
def test_in_a_shell(files, shell, script):
    if shutil.which(shell) is None:
        missing(shell)
    around = environment(PATH=f"{COMMAND.parent}{os.pathsep}{os.environ['PATH']}", HOME=str(files))
    command = [shell, *(["--norc"] if shell == "bash" else []), "-c", script.format(command=COMMAND)]
    done = subprocess.run(command, cwd=files, env=around, capture_output=True, text=True, check=False)
    found = [re.split("[\t:]", line)[0] for line in done.stdout.splitlines()]
    assert found == ["check", "ROS101", "ros2", "--select"], done.stderr


def test_another_shell_is_wrong_usage(cqos):
    assert cqos("completion", "cmd").code == 2
