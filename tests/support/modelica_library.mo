// Stand-ins for the classes of the Modelica Standard Library that the written packages use.
within ;
package Modelica
  package Icons
    partial package Package
    end Package;
  end Icons;

  package Blocks
    package Icons
      partial block Block
      end Block;
    end Icons;

    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
      connector IntegerOutput = output Integer;
      connector BooleanOutput = output Boolean;
    end Interfaces;
  end Blocks;

  package Mechanics
    package Translational
      package Interfaces
        connector Flange_b
          Real s;
          flow Real f;
        end Flange_b;
      end Interfaces;

      package Components
        model GeneralPositionToForceAdaptor
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Modelica.Blocks.Interfaces.RealInput p;
          Modelica.Blocks.Interfaces.RealInput pder if use_pder;
          Modelica.Blocks.Interfaces.RealInput pder2 if use_pder2;
          Modelica.Blocks.Interfaces.RealOutput f;
          Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
        equation
          flange.s = p;
          f = flange.f;
        end GeneralPositionToForceAdaptor;

        model Spring "A spring to the ground"
          parameter Real c;
          Modelica.Mechanics.Translational.Interfaces.Flange_b flange;
        equation
          flange.f = c*flange.s;
        end Spring;
      end Components;
    end Translational;

    package Rotational
      package Interfaces
        connector Flange_b
          Real phi;
          flow Real tau;
        end Flange_b;
      end Interfaces;

      package Components
        model GeneralAngleToTorqueAdaptor
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Modelica.Blocks.Interfaces.RealInput p;
          Modelica.Blocks.Interfaces.RealInput pder if use_pder;
          Modelica.Blocks.Interfaces.RealInput pder2 if use_pder2;
          Modelica.Blocks.Interfaces.RealOutput f;
          Modelica.Mechanics.Rotational.Interfaces.Flange_b flange;
        equation
          flange.phi = p;
          f = flange.tau;
        end GeneralAngleToTorqueAdaptor;
      end Components;
    end Rotational;
  end Mechanics;
end Modelica;
