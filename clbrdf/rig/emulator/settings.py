"""What a rig of emulated instruments is like: light, surface, effects, speed, faults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from clbrdf.errors import InputError
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.scene.curve import Curve
from clbrdf.storage.tomlfile import TomlTable


class EffectSettings(TomlTable):
    """Instrument effects; each is absent unless it is set.

    Attributes
    ----------
    shot_noise : bool
        Counting noise of the electrons.
    read_noise : float
        Standard deviation, counts.
    reference_noise : float
        Relative standard deviation of a reading of the reference power.
    lamp_drift, dark_drift : float
        Relative change per hour of the rig's time.
    nonlinearity : list of float
        Polynomial by which net counts are to be divided, lowest power first.
    stray_light : float
        Share of the mean signal that falls on every pixel.
    angle_noise : float
        Standard deviation of where a stage really stops, degrees; it reports its target.
    zero_errors : (float, float, float)
        Lamp, turn and pitch stand at what they read plus this, degrees; a tilt of the sample is the same
        as errors of turn and pitch.
    beam_width : float
        Standard deviation of the direct beam's profile in the lamp's angle, degrees; 0 for a beam of
        the same strength within half a degree.
    hunting : float
        A servo at rest is read within this many degrees of where it stands.
    shutter_time : float
        The shutter takes to open or close, s of the rig's time.
    shutter_stuck : "", "open" or "closed"
        It does not obey.
    reference_behind_shutter : bool
        The reference detector sees the lamp through the shutter.
    clip : int
        Count at which the detector clips below its full scale; 0 for none.
    """

    shot_noise: bool = False
    read_noise: Annotated[float, Field(ge=0.0)] = 0.0
    reference_noise: Annotated[float, Field(ge=0.0, lt=0.3)] = 0.0
    lamp_drift: Annotated[float, Field(gt=-1.0, lt=1.0)] = 0.0
    dark_drift: Annotated[float, Field(gt=-1.0, lt=10.0)] = 0.0
    nonlinearity: tuple[float, ...] = ()
    stray_light: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    angle_noise: Annotated[float, Field(ge=0.0, lt=5.0)] = 0.0
    zero_errors: tuple[float, float, float] = (0.0, 0.0, 0.0)
    beam_width: Annotated[float, Field(ge=0.0, lt=5.0)] = 0.0
    hunting: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    shutter_time: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    shutter_stuck: Literal["", "open", "closed"] = ""
    reference_behind_shutter: bool = False
    clip: Annotated[int, Field(ge=0, le=16383)] = 0


class LeftSettings(TomlTable):
    """In which state the last user left the instruments.

    Attributes
    ----------
    meter : list of str
        Commands given to the power meter, such as "G0" (hold) or "F1" (slow filter).
    trigger_mode, averages, boxcar : int
        Of the spectrometer.
    """

    meter: tuple[str, ...] = ()
    trigger_mode: Annotated[int, Field(ge=0, le=3)] = 0
    averages: Annotated[int, Field(ge=1, le=5000)] = 1
    boxcar: Annotated[int, Field(ge=0, le=15)] = 0


class EmulatorSettings(TomlTable):
    """The emulated rig.

    Attributes
    ----------
    parameters : mapping of str to Curve
        Of the model over wavelength, by name; missing ones take its defaults.
    scan : str
        A Scan file to take the surface from instead (nearest direction), relative to the rig file.
    direct_rate : float
        Counts per second of the brightest pixel in the direct beam.
    lamp_temperature : float
        Of the lamp as a black body, K.
    reference_power : float
        What the reference detector sees, W.
    dark_rate : float
        Counts per second without light.
    line_speed : bool
        True: bytes travel at the line's speed; False: at once.
    time_factor : float
        Seconds of the rig that pass in one of ours.
    seed : int
        Of all noise and of random faults.
    fault_rate : float
        Share of exchanges with a fault.
    faults : list of str
        Names to choose from at random; all if empty.
    """

    model: str = DEFAULT_MODEL
    parameters: dict[str, Curve] = Field(default_factory=dict)
    scan: str = ""
    direct_rate: Annotated[float, Field(gt=0.0)] = 1.0e8
    lamp_temperature: Annotated[float, Field(ge=1000.0, le=20000.0)] = 5500.0
    reference_power: Annotated[float, Field(gt=0.0)] = 1.0e-3
    dark_rate: Annotated[float, Field(ge=0.0)] = 20.0
    line_speed: bool = True
    time_factor: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0
    seed: Annotated[int, Field(ge=0)] = 0
    fault_rate: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    faults: tuple[str, ...] = ()
    effects: EffectSettings = EffectSettings()
    left: LeftSettings = LeftSettings()

    @model_validator(mode="after")
    def _check(self) -> EmulatorSettings:
        from clbrdf.rig.emulator.faults import check_names

        try:
            get_model(self.model).check_names(self.parameters)
        except InputError as error:
            raise ValueError(str(error)) from error
        check_names(list(self.faults))
        return self
