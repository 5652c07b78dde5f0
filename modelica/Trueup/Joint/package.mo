within Trueup;
package Joint "What the joint is made of"
end Joint;
