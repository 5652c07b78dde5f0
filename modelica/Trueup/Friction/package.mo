within Trueup;
package Friction "Dry friction with a static level: true stick-slip by modes, no smoothed sign"
end Friction;
