use chronicle::Divide;
use config::Robot;
use message::{Beliefs, Divergences};
use process::{Failure, Member};
use transport::Inlet;

/// What divides each partner and the robot, read from the buffers of the belief process.
pub(crate) struct Divides {
    robot: Option<Inlet<Beliefs>>,
    partners: Vec<Partner>,
}

struct Partner {
    beliefs: Inlet<Beliefs>,
    divergences: Inlet<Divergences>,
    divide: Divide,
    /// The belief process's life that was listened to: identities are another's in every life.
    life: u64,
}

impl Divides {
    /// Opens the buffers of so many partners; none where perspective taking is off.
    pub(crate) fn open(member: &Member, robot: &Robot, partners: u32) -> Result<Self, Failure> {
        let names = &robot.leo.belief.names;
        let open = |partner: u16| {
            let number = Some(u32::from(partner));
            Ok(Partner {
                beliefs: member.inlet(number)?,
                divergences: member.inlet(number)?,
                divide: Divide::new(&robot.percepts, &names.of(partner)),
                life: 0,
            })
        };
        let partners: Vec<Partner> = (1..=u16::MAX)
            .take_while(|partner| u32::from(*partner) <= partners)
            .map(open)
            .collect::<Result<_, Failure>>()?;
        let robot = if partners.is_empty() { None } else { Some(member.inlet(Some(0))?) };
        Ok(Self { robot, partners })
    }

    /// Tells what is new, with the instant that it is of.
    pub(crate) fn tell(&mut self, mut tell: impl FnMut(u64, &str)) -> Result<(), Failure> {
        let Some(robot) = &mut self.robot else { return Ok(()) };
        let Some(robots) = robot.newest()? else { return Ok(()) };
        for partner in &mut self.partners {
            // The two may be a frame apart: what one does not know yet is told at the next look.
            let (his, differing) = (partner.beliefs.newest()?, partner.divergences.newest()?);
            let (Some(his), Some(differing)) = (his, differing) else { continue };
            if differing.head().compared == 0 {
                continue;
            }
            let header = differing.head().header;
            if std::mem::replace(&mut partner.life, header.incarnation) != header.incarnation {
                partner.divide.forget();
            }
            let at_ns = header.valid_at_ns;
            partner.divide.note(at_ns, differing.entries(), robots.entries(), his.entries(), |words| {
                tell(at_ns, words);
            });
        }
        Ok(())
    }
}
