"""An S3 server (object storage, by moto) on this machine for tests. Prints its address, and serves until its input ends.

    TARGET/s3-test/bin/python tests/s3/server.py
"""

import sys

from moto.server import ThreadedMotoServer

server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
server.start()
host, port = server.get_host_and_port()
print(f"http://{host}:{port}", flush=True)
sys.stdin.read()
server.stop()
