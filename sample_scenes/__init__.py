"""The project's own characters, motions and scenes: what the demo shows and what the tests walk on.

Each motion is one function: a body and a few numbers in, a `motion.BodyMotion` out, which `keys.write_action` keys on
the armature that `character.create_character` makes of the same body.

======================  =============================================  ============================================
module                  motion                                         of
======================  =============================================  ============================================
`gait`, `run`           `walk(body, Gait())`, `run(body, Run())`       `body.Body`, over any `course.Course`
`snowshoe`              `walk(body, ON_SNOWSHOES)`                     `body.Body` after `put_on_snowshoes`
`jump`                  `jump(body, Jump())`                           `body.Body`
`showpieces`            `kick(body)`, `dance(body)`                    `body.Body`
`cartwheel`             `cartwheel(body)`                              `body.Body`, on feet and hands
`four_legged`           `go_on_four_legs(dog, WALK)`, `... TROT)`      `dog.Dog`, over any `course.Course`
`cane`                  `with_cane(body, walk(...))`                   `body.Body` and `cane.create_cane`
`fall`                  `fall_back(body, ...)`                         `body.Body`, on feet, back and arms
`rolling_things`        `roll_along(wheel, ...)`, `drop(ball, ...)`    plain objects
======================  =============================================  ============================================

Bodies and motions have x forward, y left and z up; in Blender characters face -Y (`character.TO_BLENDER`).
"""
