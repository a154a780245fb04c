"""Processes of one ROS 2 system that no other system can see or disturb."""

from __future__ import annotations

import os
import random
import shutil
import signal
import socket
import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

#: Domains above 101 collide with the ephemeral ports of Linux (Fast DDS's port formula).
DOMAINS = range(1, 102)
FIRST_DISCOVERY_PORT, PORTS_PER_DOMAIN, UNICAST_OFFSET = 7400, 250, 10

#: What would lead out of the domain.
FOREIGN = ('ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER', 'ROS_LOCALHOST_ONLY', 'ROS_NAMESPACE')


class Domain:
    """
    A ROS domain of one's own on this machine, until it is given back.

    Nobody holds its first participant's port (RTPS 2.3, section 9.6), and nobody else who asks this
    class gets it: a name of Linux's abstract socket space is held until `release`, or the end of
    the process, for a port is held only some time after a process has chosen it.
    """

    def __init__(self) -> None:
        for domain in random.sample(DOMAINS, len(DOMAINS)):
            claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            port = FIRST_DISCOVERY_PORT + PORTS_PER_DOMAIN * domain + UNICAST_OFFSET
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                try:
                    claim.bind(f'\0w2b ROS domain {domain}')
                    probe.bind(('127.0.0.1', port))
                except OSError:
                    claim.close()
                    continue
            self.number, self._claim = domain, claim
            return
        raise RuntimeError('all ROS domains from 1 to 101 are in use on this machine')

    def release(self) -> None:
        """Give the domain back."""
        self._claim.close()


class RosSession:
    """
    A ROS domain of its own on this machine, and the processes started in it.

    As a context manager it sets the environment of this process too, and ends what it started.
    """

    def __init__(self, log_folder: Path) -> None:
        self.log_folder = log_folder
        self._domain = Domain()
        self.environment: Mapping[str, str] = {
            **{name: value for name, value in os.environ.items() if name not in FOREIGN},
            'ROS_DOMAIN_ID': str(self._domain.number),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'PYTHONUNBUFFERED': '1'}
        self._processes: list[tuple[str, subprocess.Popen[bytes]]] = []

    def __enter__(self) -> RosSession:
        self.log_folder.mkdir(parents=True, exist_ok=True)
        for name in FOREIGN:
            os.environ.pop(name, None)
        os.environ.update(self.environment)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        for _name, process in self._processes:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for _name, process in self._processes:
            try:
                process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._domain.release()

    def start(self, executable: str, **parameters: object) -> None:
        """Start an installed node with ROS parameters; its output goes to the log folder."""
        arguments = ['--ros-args']
        for name, value in parameters.items():
            arguments += ['-p', f'{name}:={value}']
        with (self.log_folder / f'{executable}.log').open('wb') as log:
            process = subprocess.Popen([_installed(executable), *arguments], env=self.environment,
                                       stdout=log, stderr=subprocess.STDOUT)
        self._processes.append((executable, process))

    def check_alive(self) -> None:
        """Raise RuntimeError, with the end of its log, if a process has ended."""
        for name, process in self._processes:
            if process.poll() is not None:
                log = (self.log_folder / f'{name}.log').read_text(errors='replace')
                raise RuntimeError(f'{name} ended with exit code {process.returncode}: '
                                   f'{log[-2000:].strip()}')


def _installed(executable: str) -> str:
    path = shutil.which(executable)
    if path is None:
        raise RuntimeError(f'{executable}: not found on PATH; expected the built workspace; '
                           f'run: make demo')
    return path
