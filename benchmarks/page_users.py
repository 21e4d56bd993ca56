"""Many users of the page at once: time from a question of Explore to its answer.

``python -m benchmarks.page_users`` starts a server and as many clients as ``--users``, each of
which asks again as soon as it is answered, as a slider that never rests would, while one more
client has asked for the largest map.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import statistics
import subprocess
import sys
import threading
import time
from urllib.parse import urlsplit

POINT = {"law": "rice-ruina", "laws": ["elasto-plastic"]}


def ask(port: int, path: str, question: dict, client: str) -> bytes:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
    headers = {"Content-Type": "application/json", "X-Client": client}
    connection.request("POST", f"/api/{path}", json.dumps(question), headers)
    answer = connection.getresponse().read()
    connection.close()
    return answer


def question(k: int) -> dict:
    numbers = {"V": 1e-6 * (1 + 0.01 * k), "epsilon": 0.1 + 0.001 * k, "frequency": 120.0}
    return {**POINT, "numbers": numbers}


def user(port: int, name: str, count: int, times: list[float]) -> None:
    for k in range(count):
        start = time.perf_counter()
        ask(port, "explore", question(k), name)
        times.append(time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--users", type=int, default=50)
    parser.add_argument("--questions", type=int, default=10)
    parser.add_argument("--no-map", action="store_true")
    options = parser.parse_args()
    command = [sys.executable, "-m", "asperity", "serve", "--port", "0"]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    address = next(word for word in server.stderr.readline().split() if word.startswith("http"))
    port = urlsplit(address).port
    try:
        while b"preparing" in ask(port, "explore", question(0), "first"):
            time.sleep(0.5)
        if not options.no_map:
            axes = {"x": {"name": "epsilon", "low": 0.01, "high": 0.5},
                    "y": {"name": "K", "low": 2e3, "high": 2e6, "log": True}}  # fmt: skip
            whole = {"law": "rice-ruina", "numbers": {"V": 1e-6}, "count": 128, **axes}

            def largest_map() -> None:
                with contextlib.suppress(
                    http.client.HTTPException, OSError
                ):  # ends with the server
                    ask(port, "map", whole, "map")

            threading.Thread(target=largest_map, daemon=True).start()
            time.sleep(3)
        for users in dict.fromkeys([1, options.users]):
            times: list[float] = []
            threads = [
                threading.Thread(target=user, args=(port, f"user-{n}", options.questions, times))
                for n in range(users)
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            times.sort()
            p95 = times[int(0.95 * len(times))]
            print(
                f"{users} users, {len(times)} answers: median "
                f"{1e3 * statistics.median(times):.0f} ms, p95 {1e3 * p95:.0f} ms"
            )
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
