"""Uses a client that was made from the contract: folder of the client, address of the service, folder of the examples."""

import json
import sys
from pathlib import Path

folder, address, examples = sys.argv[1:]
sys.path.insert(0, folder)

from railhead_client import Client  # noqa: E402
from railhead_client.api.jobs import get_job, submit_job  # noqa: E402
from railhead_client.models import AskedMotion, Case, Problem, ProfilesContact, RadiiContact, State, SweepMotions, WheelsetMotion  # noqa: E402


def case(name):
    return Case.from_dict(json.loads(Path(examples, f"{name}.case.json").read_text()))


hertz, sweep, wheel = case("hertz-steel"), case("sweep"), case("wheel-rail")
assert isinstance(hertz.contact, RadiiContact) and isinstance(hertz.motion, AskedMotion), hertz
assert isinstance(sweep.motion, SweepMotions), sweep
assert isinstance(wheel.contact, ProfilesContact) and isinstance(wheel.motion, WheelsetMotion), wheel

client = Client(base_url=address)
job = submit_job.sync(client=client, body=hertz, prefer="wait=30")
assert job.state == State.SUCCEEDED, job
again = get_job.sync(client=client, id=job.id)
assert again.id == job.id
hertz.friction.coefficient = -1.0
refused = submit_job.sync(client=client, body=hertz)
assert isinstance(refused, Problem), refused
assert refused.errors[0].pointer == "/friction/coefficient", refused
print(job.result.total[0].force_x_n)
