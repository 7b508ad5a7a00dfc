#!/usr/bin/env python3
"""A run on an RTSP stream: frames of a rendered drive are pushed by ffmpeg to a small server here (RTSP 1.0, RTP over the same TCP connection), and
`motorcade run rtsp://… --online` reads them from it. Checked: every frame arrives, a tenth of a second after the one before to a millisecond, and the run ends with
results when the stream does. ffmpeg gives the first two frames of an RTSP stream one time, so that one frame may be left out, and told.

    scripts/check_rtsp.py [target/release/motorcade]

Needs ffmpeg with libx264.
"""
import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading

program = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/motorcade").resolve()
FRAMES = 40


class Relay:
    """Takes one stream that is announced and hands it to one that plays it; what comes before is kept for it."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.sdp = b""
        self.announced, self.playing = threading.Event(), threading.Event()
        self.player, self.kept, self.lock = None, [], threading.Lock()
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            connection, _ = self.listener.accept()
            threading.Thread(target=self.serve, args=(connection,), daemon=True).start()

    def serve(self, connection):
        stream = connection.makefile("rb")
        publishes = False
        while first := stream.read(1):
            if first == b"$":
                head = stream.read(3)
                packet = first + head + stream.read(int.from_bytes(head[1:], "big"))
                if publishes:
                    self.forward(packet)
                continue
            method, _, _ = (first + stream.readline()).decode().split(" ")
            headers = {}
            while (line := stream.readline().decode().strip()):
                name, _, value = line.partition(":")
                headers[name.lower()] = value.strip()
            body = stream.read(int(headers.get("content-length", 0)))
            answer, content = [f"CSeq: {headers['cseq']}", "Session: 1"], b""
            if method == "OPTIONS":
                answer.append("Public: OPTIONS, DESCRIBE, ANNOUNCE, SETUP, PLAY, RECORD, TEARDOWN")
            elif method == "ANNOUNCE":
                publishes, self.sdp = True, body
            elif method == "DESCRIBE":
                self.announced.wait(20)
                content = self.sdp
                answer += ["Content-Type: application/sdp", f"Content-Length: {len(content)}"]
            elif method == "SETUP":
                answer.append(f"Transport: {headers['transport']}")
            if method == "TEARDOWN":
                # Nobody waits for the answer.
                break
            connection.sendall(("RTSP/1.0 200 OK\r\n" + "\r\n".join(answer) + "\r\n\r\n").encode() + content)
            if method == "RECORD":
                self.announced.set()
            elif method == "PLAY":
                with self.lock:
                    self.player = connection
                    for packet in self.kept:
                        connection.sendall(packet)
        if publishes:
            with self.lock:
                if self.player:
                    self.player.shutdown(socket.SHUT_WR)

    def forward(self, packet):
        with self.lock:
            if self.player is None:
                self.kept.append(packet)
            else:
                self.player.sendall(packet)


def call(*command, **more):
    return subprocess.run([str(c) for c in command], check=True, **more)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    call(program, "simulate", "--scenario", "demo", "--frames", FRAMES, "--width", 400, "--out", folder / "drive", "--progress", "none", stdout=subprocess.DEVNULL)
    training = next((folder / "drive").rglob("image_02")).parent
    ending = next(iter((training / "image_02" / "0000").iterdir())).suffix
    line = next(l for l in (training / "calib" / "0000.txt").read_text().splitlines() if l.startswith("P2"))
    p = [float(v) for v in line.split()[1:]]
    (folder / "camera.toml").write_text(f"fx = {p[0]}\nfy = {p[5]}\ncx = {p[2]}\ncy = {p[6]}\n")
    relay = Relay()
    address = f"rtsp://127.0.0.1:{relay.port}/drive"
    push = ["ffmpeg", "-v", "error", "-nostdin", "-re", "-framerate", 10, "-i", training / "image_02" / "0000" / f"%06d{ending}", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2"]
    push += ["-c:v", "libx264", "-tune", "zerolatency", "-pix_fmt", "yuv420p", "-f", "rtsp", "-rtsp_transport", "tcp", address]
    pusher = subprocess.Popen([str(c) for c in push])
    assert relay.announced.wait(20), "ffmpeg did not announce its stream"
    run = [program, "run", address, "--online", "--calibration", folder / "camera.toml", "--height", 1.65, "--out", folder / "out", "--models", "none", "--progress", "none"]
    done = subprocess.run([str(c) for c in run], capture_output=True, text=True, timeout=120)
    pusher.wait(20)
    lines = done.stdout.splitlines()
    times = [float(row.split()[0]) for row in (folder / "out" / "ego.tum").read_text().splitlines()] if (folder / "out").exists() else []
    print(f"exit {done.returncode}, {len(lines)} lines, times {times[:3]} to {times[-1:]}; said: {done.stderr.strip()[:400]}")
    problems = []
    left_out = "1 of 40 frames had a time" in done.stderr
    if done.returncode != 0 or len(lines) != FRAMES - left_out:
        problems.append(f"exit {done.returncode}, {len(lines)} of {FRAMES} frames")
    if any(abs(time - 0.1 * k) > 1e-3 for k, time in enumerate(times)):
        problems.append(f"times are not those of the stream: {times}")
    if times and json.loads((folder / "out" / "run.json").read_text())["input"]["format"] != "live":
        problems.append("the record does not say that the input was live")
sys.exit("failed: " + "; ".join(problems) if problems else 0)
