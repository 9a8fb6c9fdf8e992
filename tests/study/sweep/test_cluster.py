import os
import signal
from contextlib import nullcontext

import pandas as pd
import pytest

from designer.files import InputError
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.run import run_sweep
from designer.study.sweep.tables import read_sweep_results

pytest.importorskip("distributed")


@pytest.mark.slow
def test_cluster_gives_the_local_table_though_a_worker_is_killed(quick_sweep, tmp_path, undisturbed):
    from designer.study.sweep.cluster import cluster_workers

    definition, base = read_sweep(quick_sweep)
    killed = []
    with cluster_workers(workers=2) as cluster:

        def kill_one(progress):
            if (progress.round, progress.done) == (0, 2):
                processes = cluster.client.run(os.getpid)
                killed.append(min(processes.values()))
                os.kill(killed[0], signal.SIGKILL)

        run_sweep(definition, base, tmp_path / "out", workers=nullcontext(cluster), progress=kill_one)
    assert killed
    pd.testing.assert_frame_equal(read_sweep_results(tmp_path / "out"), undisturbed, check_exact=True)


def test_address_where_nothing_answers_gets_one_line(monkeypatch):
    from designer.study.sweep import cluster

    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with (
        pytest.raises(InputError, match="no response from this address"),
        cluster.cluster_workers(scheduler="tcp://127.0.0.1:9"),
    ):
        pass
