"""Fleets on a real Ray cluster of two nodes on this machine, with object storage of moto's server.

Needs `pip install motorcade[fleet,fleet-tests]`.
"""

import os
import pathlib
import signal

import pyarrow.dataset
import pyarrow.parquet
import pytest
import ray
from moto.server import ThreadedMotoServer
from ray.cluster_utils import Cluster

import motorcade
import motorcade.fleet
from motorcade.fleet import _drive, _manifest

DRIVES, FRAMES = 40, 12
TASK = b"ray::motorcade drive"


@pytest.fixture(scope="module")
def bucket():
    """A bucket on a server of this machine. Workers see it by their environment, so it starts before the cluster."""
    server = ThreadedMotoServer(port=0)
    server.start()
    _, port = server.get_host_and_port()
    os.environ |= {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    import s3fs

    s3fs.S3FileSystem().mkdir("fleet")
    yield "s3://fleet"
    server.stop()


@pytest.fixture
def cluster(bucket):
    """Two nodes of a core each."""
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    second = cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster, second
    ray.shutdown()
    cluster.shutdown()


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    """Rendered drives with the simulation's own boxes and road, on two dates."""
    folder = tmp_path_factory.mktemp("drives")
    rows = ["id,date,input,sequence,models,detections,road_masks,settings"]
    for k in range(DRIVES):
        made = motorcade.simulate("demo", folder / f"d{k:02}", frames=FRAMES, width=320, seed=k + 1)
        files = [path.relative_to(folder) for path in (made.training, made.detections, made.road_masks)]
        # What is fixed to the camera is not found in so short a drive.
        cells = [f"drive-{k:02}", f"2026-05-0{1 + k % 2}", files[0], made.sequence, "none", *files[1:], "run.fixed_regions=false"]
        rows.append(",".join(map(str, cells)))
    path = folder / "drives.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def single(manifest, tmp_path_factory):
    """The same drives one after the other in this process."""
    out = tmp_path_factory.mktemp("single")
    for job in _manifest.read(str(manifest), {}):
        assert _drive.execute(job, str(out), 1)["status"] == "done"
    return out


def tables(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.glob("*/date=*/*.parquet"))}


def kill_a_worker():
    """The process of one drive that runs."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cmdline").read_bytes().startswith(TASK):
                os.kill(int(process.name), signal.SIGKILL)
                return True
        except OSError:
            continue
    return False


def test_every_drive_is_done_once_though_a_worker_and_a_node_die(cluster, manifest, single, tmp_path):
    nodes, second = cluster
    killed = []

    def disturb(done, total, line):
        assert total == DRIVES
        if done >= 8 and not killed:
            killed.extend(["worker"] if kill_a_worker() else [])
        if done == 16:
            nodes.remove_node(second, allow_graceful=False)
            killed.append("node")

    lines = motorcade.fleet.run(manifest, tmp_path, progress=disturb)
    assert killed == ["worker", "node"]
    assert [line["id"] for line in lines] == [f"drive-{k:02}" for k in range(DRIVES)]
    assert all(line["status"] == "done" and line["frames"] == FRAMES for line in lines)
    assert tables(tmp_path) == tables(single) and len(tables(single)) == 2 * DRIVES
    frames = pyarrow.dataset.dataset(tmp_path / "frames", partitioning="hive").to_table()
    assert frames.num_rows == DRIVES * FRAMES
    assert len(set(frames["drive_id"].to_pylist())) == DRIVES
    assert set(frames["date"].to_pylist()) == {"2026-05-01", "2026-05-02"}
    done = pyarrow.parquet.read_table(tmp_path / "manifest.done.parquet")
    assert done["id"].to_pylist() == [line["id"] for line in lines]
    assert not list(tmp_path.rglob("*.part"))

    # Again: nothing is computed.
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("runs/*/run.json")}
    assert motorcade.fleet.run(manifest, tmp_path) == lines
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.glob("runs/*/run.json")}


def test_inputs_and_results_on_object_storage(cluster, manifest, single, bucket, tmp_path):
    import s3fs

    store = s3fs.S3FileSystem()
    header, *rows = manifest.read_text().splitlines()[:3]
    for k in range(2):
        store.put(str(manifest.parent / f"d{k:02}"), f"fleet/in/d{k:02}", recursive=True)
    broken = "broken,2026-05-01,nothing.mp4,,,,,"
    store.pipe_file("fleet/in/drives.csv", "\n".join([header, *rows, broken]).encode())
    lines = motorcade.fleet.run(f"{bucket}/in/drives.csv", f"{bucket}/out", height=1.65)
    assert [line["status"] for line in lines] == ["done", "done", "failed"]
    assert "nothing.mp4" in lines[2]["message"]
    for k, date in enumerate(["2026-05-01", "2026-05-02"]):
        name = f"tracks/date={date}/drive-{k:02}.parquet"
        assert store.cat_file(f"fleet/out/{name}") == (single / name).read_bytes()
        assert store.exists(f"fleet/out/runs/drive-{k:02}/run.json")
    assert store.exists("fleet/out/manifest.done.parquet")


def test_a_run_of_somebody_else_is_not_replaced(manifest, tmp_path):
    job = _manifest.read(str(manifest), {})[0]
    record = tmp_path / "runs" / job.id / "run.json"
    record.parent.mkdir(parents=True)
    record.write_text("mine")
    line = _drive.execute(job, str(tmp_path), 1)
    assert line["status"] == "failed" and "choose another out" in line["message"]
    assert record.read_text() == "mine" and not (tmp_path / "done").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("id,input\na,x.mp4\na,y.mp4\n", "drives.csv:3: `a` is the id of line 2 too"),
        ("input,colour\nx.mp4,red\n", "drives.csv:2: column `colour` is not known"),
        ("input,height\nx.mp4,tall\n", "drives.csv:2: column `height`"),
        ("id,input\n../x,y.mp4\n", "cannot name a directory"),
        ("id,input\na\n", "drives.csv:2: expected 2 cells"),
        ("id\na\n", "column `input` is empty"),
    ],
)
def test_manifests_that_cannot_be_run(text, said, tmp_path):
    path = tmp_path / "drives.csv"
    path.write_text(text)
    with pytest.raises(motorcade.InputError, match=".*") as error:
        _manifest.read(str(path), {})
    assert said in str(error.value)
