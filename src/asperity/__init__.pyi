# Public names of the package, each with its module; `asperity._lazy` imports them when used.

from asperity import (
    air as air,
    branches as branches,
    experiment as experiment,
    figures as figures,
    inference as inference,
    laws as laws,
    ledger as ledger,
    loads as loads,
    lock_in as lock_in,
    materials as materials,
    measurement as measurement,
    orbit as orbit,
    parameters as parameters,
    protocol as protocol,
    recording as recording,
    samples as samples,
    slider as slider,
    study as study,
    theory as theory,
    transients as transients,
    tribometer as tribometer,
    units as units,
)
from asperity._version import __version__ as __version__
from asperity.app.notebook import explore as explore
from asperity.branches import (
    continuation as continuation,
    doubled_branch as doubled_branch,
    stability_boundary as stability_boundary,
)
from asperity.errors import InputError as InputError
from asperity.inference.answers import (
    compare as compare,
    fit as fit,
)
from asperity.measurement.from_file import measure_recording
from asperity.measurement.write import write as write
from asperity.orbit import (
    averaged_response as averaged_response,
    periodic_response as periodic_response,
    response_function as response_function,
    sensitivities as sensitivities,
)
from asperity.protocol.run import run_protocol
from asperity.recording.readers import read as read
from asperity.slider import Slider as Slider
from asperity.study.map import response_map
from asperity.study.threshold import stiffness_threshold as stiffness_threshold
from asperity.theory import perturbation_response as perturbation_response
from asperity.transients import transient as transient

measure = measure_recording
run = run_protocol
map = response_map
#: What a study is called where it is run.
sweep = study
