"""Many users of the page at once: time from a question of Explore to its answer.

``python -m benchmarks.page.users`` starts a server and ``--users`` clients. Each client sends the
next question as soon as it has an answer, like a slider in motion, while one more client waits for
the largest map.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import statistics
import threading
import time

from benchmarks.page.serving import ask, load, quantile, serving

POINT = {"law": "rice-ruina", "laws": ["elasto-plastic"]}


def question(k: int) -> dict:
    numbers = {"V": 1e-6 * (1 + 0.01 * k), "epsilon": 0.1 + 0.001 * k, "frequency": 120.0}
    return {**POINT, "numbers": numbers}


def user(port: int, count: int, times: list[float]) -> None:
    for k in range(count):
        start = time.perf_counter()
        ask(port, "explore", question(k))
        times.append(time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--users", type=int, default=50)
    parser.add_argument("--questions", type=int, default=10)
    parser.add_argument("--no-map", action="store_true")
    options = parser.parse_args()
    with serving() as server:
        port = server.port
        while b"preparing" in ask(port, "explore", question(0)):
            time.sleep(0.5)
        if not options.no_map:
            axes = {"x": {"name": "epsilon", "low": 0.01, "high": 0.5},
                    "y": {"name": "K", "low": 2e3, "high": 2e6, "log": True}}  # fmt: skip
            whole = {"law": "rice-ruina", "numbers": {"V": 1e-6}, "count": 128, **axes}

            def largest_map() -> None:
                with contextlib.suppress(
                    http.client.HTTPException, OSError
                ):  # ends with the server
                    ask(port, "map", whole)

            threading.Thread(target=largest_map, daemon=True).start()
            time.sleep(3)
        for users in dict.fromkeys([1, options.users]):
            times: list[float] = []
            threads = [
                threading.Thread(target=user, args=(port, options.questions, times))
                for _ in range(users)
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            print(
                f"{users} users, {len(times)} answers: median "
                f"{1e3 * statistics.median(times):.0f} ms, p95 {1e3 * quantile(times, 0.95):.0f} ms"
                f"; {load()}"
            )


if __name__ == "__main__":
    main()
