"""Installs the programs that some tests need where that is allowed, and names the tests that are left out elsewhere.

python scripts/system_packages.py             install what is missing, as root on Debian; else say what is left out
python scripts/system_packages.py --missing   print the names of the packages that are missing, for `apt-get install`
"""  # noqa: INP001 - a script

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGES = (
    ("g++", "g++", "no pair runs on Fast DDS"),
    ("fastdds/config.hpp|fastrtps/config.h", "libfastrtps-dev", "no pair runs on Fast DDS"),
    ("mosquitto", "mosquitto", "the MQTT pack is not compared with Mosquitto"),
    ("rabbitmqctl", "rabbitmq-server", "the MQTT pack is not compared with RabbitMQ"),
    ("spin", "spin", "SPIN gives no second opinion on MQTT"),
    ("gcc", "gcc", "SPIN gives no second opinion on MQTT"),
    ("ip", "iproute2", "the traffic of Cyclone DDS is not measured"),
    ("java", "default-jre-headless", "no audit runs on a Spark cluster"),
    (
        "chromium-headless-shell|chromium|chromium-browser|google-chrome",
        "chromium-headless-shell",
        "the page of the modeler is not tried",
    ),
    ("nvim", "neovim", "the language server is not tried in an editor"),
    ("zsh", "zsh", "completion is not tried in zsh"),
    ("fish", "fish", "completion is not tried in fish"),
    ("dot", "graphviz", "graphs are not read by Graphviz"),
    ("systemd-analyze", "systemd", "the unit of the service is not read by systemd"),
)
"""Programs or headers, the package of Debian that has them, and what is left out without."""
INCLUDES = Path("/usr/include")
SYSTEM_FOLDERS = "/usr/sbin:/usr/local/sbin:/opt/homebrew/sbin"


def main(arguments: list[str]) -> int:
    """Install what is missing, or list it."""
    for programs, package, left_out in PACKAGES:
        if any(map(is_there, programs.split("|"))):
            continue
        if arguments == ["--missing"]:
            sys.stdout.write(f"{package}\n")
        elif not install(package):
            sys.stderr.write(f"{package} is not installed, so {left_out} (apt-get install {package})\n")
    return 0


def is_there(program: str) -> bool:
    """Whether a program can be started, or a header included."""
    if shutil.which(program) or shutil.which(program, path=SYSTEM_FOLDERS):
        return True
    return any(True for pattern in (program, f"*-linux-*/{program}") for _ in INCLUDES.glob(pattern))


def install(package: str) -> bool:
    """Install a package of the system; return whether that worked."""
    apt_get = shutil.which("apt-get")
    if apt_get is None or os.geteuid() != 0:  # type: ignore[attr-defined,unused-ignore] # not on Windows
        return False
    sys.stderr.write(f"installing {package}, which tests need ...\n")
    for arguments in (["update"], ["install", "-y", "--no-install-recommends", package]):
        done = subprocess.run(  # noqa: S603 - commands of this file
            [apt_get, "-qq", *arguments],
            env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            check=False,
        )
    return done.returncode == 0  # of the installation; a failed update matters only if that fails too


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
