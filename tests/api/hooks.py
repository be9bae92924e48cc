"""What schemathesis is told of this API: see test_operations.py, which sets the environment."""

import json
import os

import httpx
import schemathesis
from archives import archives
from hypothesis import strategies as st

API = os.environ["API_URL"]
TOKEN = os.environ.get("API_TOKEN")
IDS = json.loads(os.environ["API_IDS"])
LOSING = json.loads(os.environ["API_LOSING"])

# Bodies that no schema describes.
for media_type in json.loads(os.environ["API_ARCHIVE_TYPES"]):
    schemathesis.openapi.media_type(media_type, archives)


@schemathesis.hook
def flatmap_path_parameters(context, path_parameters):
    """Ids of what there is in place of most of those that name nothing."""
    resource = context.operation.path.removeprefix("/api/v1/").split("/")[0]
    known = IDS.get(resource)
    if not known or not path_parameters or "id" not in path_parameters:
        return st.just(path_parameters)
    there = st.sampled_from(known).map(lambda one: {**path_parameters, "id": one})
    return st.one_of(there, there, there, st.just(path_parameters))


if TOKEN is not None:

    @schemathesis.auth(refresh_interval=None)
    class Bearer:
        """Who signs out, rotates or revokes does so with a token made for it: the next case needs its own."""

        spare = None

        def get(self, case, context):
            if case.operation.definition.raw.get("operationId") not in LOSING:
                return TOKEN
            # A person has so many tokens at a time and no more, so one is made when the last is gone.
            if self.spare is None or ask("GET", "/whoami", self.spare).status_code == 401:
                self.spare = ask("POST", "/tokens", TOKEN, json={"name": "once"}).json()["secret"]
            return self.spare

        def set(self, case, data, context):
            case.headers["Authorization"] = f"Bearer {data}"


def ask(method, path, token, **request):
    headers = {"Authorization": f"Bearer {token}"}
    return httpx.request(method, API + path, headers=headers, timeout=None, **request)
