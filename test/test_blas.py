# SPDX-License-Identifier: Apache-2.0
import os
import subprocess
import sys

from ccr_ros.blas import use_one_thread


def test_the_environment_has_the_last_word(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "4")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    use_one_thread()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "4" and os.environ["MKL_NUM_THREADS"] == "1"


def test_commands_say_it_before_numpy_is_loaded():
    code = (
        "import os, sys\nfrom ccr_ros.cli.main import main\n"
        "assert 'numpy' not in sys.modules\n"
        "try: main(['--version'])\nexcept SystemExit: pass\n"
        "print(os.environ['OPENBLAS_NUM_THREADS'], file=sys.stderr)"
    )
    env = {k: v for k, v in os.environ.items() if "NUM_THREADS" not in k}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env)
    assert done.stderr == "1\n"
