"""Hooks for schemathesis, which generates requests from the OpenAPI document. test_operations.py sets the environment variables."""

import json
import os

import httpx
import schemathesis
from archives import archives
from hypothesis import strategies as st

API = os.environ["API_URL"]
TOKEN = os.environ.get("API_TOKEN")
# Ids of existing resources, by the first part of the path.
IDS = json.loads(os.environ["API_IDS"])
# Ids of the operations that can end the token of the request.
TOKEN_ENDING = json.loads(os.environ["API_TOKEN_ENDING"])

# The bodies of uploads, which have no schema.
for media_type in json.loads(os.environ["API_ARCHIVE_TYPES"]):
    schemathesis.openapi.media_type(media_type, archives)


@schemathesis.hook
def flatmap_path_parameters(context, path_parameters):
    """Replaces most generated ids by ids of existing resources."""
    resource = context.operation.path.removeprefix("/api/v1/").split("/")[0]
    existing_ids = IDS.get(resource)
    if not existing_ids or not path_parameters or "id" not in path_parameters:
        return st.just(path_parameters)
    with_existing = st.sampled_from(existing_ids).map(lambda existing: {**path_parameters, "id": existing})
    # Three of four requests have an existing id.
    return st.one_of(with_existing, with_existing, with_existing, st.just(path_parameters))


if TOKEN is not None:

    @schemathesis.auth(refresh_interval=None)
    class Bearer:
        """Operations that sign out, rotate or revoke use a spare token, which is replaced once it is invalid."""

        spare = None

        def get(self, case, context):
            if case.operation.definition.raw.get("operationId") not in TOKEN_ENDING:
                return TOKEN
            # The number of a user's tokens is limited, so a new one is created only when the last one is invalid.
            if self.spare is None or request("GET", "/whoami", self.spare).status_code == 401:
                self.spare = request("POST", "/tokens", TOKEN, json={"name": "spare"}).json()["secret"]
            return self.spare

        def set(self, case, data, context):
            case.headers["Authorization"] = f"Bearer {data}"


def request(method, path, token, **options):
    headers = {"Authorization": f"Bearer {token}"}
    return httpx.request(method, API + path, headers=headers, timeout=None, **options)
