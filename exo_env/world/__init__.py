"""One world or many: the arrays of an episode, a control period, a reset, the batch.

Words of exo_env, each for one thing:

    world          all arrays of one environment, a packed `WorldTables` w that compiled code takes (tables.py)
    control period the time between two actions; control times are its multiples
    episode        from a reset to an event or the end of the time; everything random in it follows from one key
    key, stream    the number that a reset takes from the generator; random numbers of a key under a name (streams.py)
    draw           what is drawn for an episode: patient, load, movement, start
    patient, trait who is in the device, as a row of numbers; one of these numbers (traits.py)
    population     distributions from which patients are drawn; the argument `patient` takes one, or a patient
    psi            the elbow angle over time [rad] that the patient intends and errors are measured from
    reference      another word for psi, in channels, figures and papers; the argument `reference` of an environment
                   changes the distributions of its movement
    movement       a family of psi, one for each row of numbers (tasks/movements/movement.py)
    course         psi, its rate and its acceleration at several times, shape (k, 3)
    need, ability  the moment that the movement needs; the share of it that the patient can give (patient/ability.py)
    motor command  activations that the patient plans along psi (patient/excitation/motor_command.py)
    effort         factor s on the motor command, which falls and rises with the error (patient/excitation/slacking.py)
    excitation     input of a muscle, between 0.01 and 1; activation is what the muscle makes of it
    action         numbers from -1 to 1 that an agent gives for a control period
    drive          what makes commands of an action (drives/drive.py)
    command        input of the model that a drive sets, such as the tension of a rope
    sensor         a quantity of the dms_core model, without noise (ecosystem/sensors.py); y holds all their components
    reading        true numbers that a task knows: copied sensors, traits, or what its kernel puts there
    estimate       what the device's own filter makes of its measurements; a reading like others where it is shown
    channel        a reading as an agent sees it: in a scale, with an imperfection; groups hold channels
    imperfection   noise, delay and quantum of a channel
    component      one number of a reading, a channel or a sensor
    term, weight   a part of the reward, and its factor; `weight` is also the mass on the gym machine, as is `load`
    event          what ends an episode before its time; its sentence is in `info`
    numbers        of a task, a drive, a movement, a model: the constants that its compiled code reads, as an array
    places         named positions in such an array (places.py)
    kept, cleared  whether a reset leaves an array as it is or sets it to zero (clearing.py)
"""
